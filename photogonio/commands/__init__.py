"""One module for each subcommand: ``run(args, reporter)`` does it and returns its numbers."""
