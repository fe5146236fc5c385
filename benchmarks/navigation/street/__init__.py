"""smartLoc: a car among the buildings of Berlin."""
