"""The shell around the commands: their declaration, options in common, help, completion, printing, exit codes."""
