"""Between a host and Python: what makes an FMU run in any tool."""
