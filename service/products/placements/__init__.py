"""Where to put anchors."""
