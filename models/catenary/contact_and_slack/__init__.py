"""contact_and_slack."""
