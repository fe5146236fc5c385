"""What pictures share: the sheet, relief, classes, map furniture."""
