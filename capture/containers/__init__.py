"""What does a file say besides its pixels?

Takes the bytes of PNG, JPEG, TIFF, DNG, HEIF and JPEG XL files; gives tone curves, EXIF, pages, opcodes, faults.
"""
