"""How close and how fast on worlds whose answer is known?

Takes scenes, tables; gives scores kept and compared.
"""
