"""definition_files."""
