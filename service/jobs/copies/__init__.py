"""Data folders looked at whole: checked, backed up, restored."""
