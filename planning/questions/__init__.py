"""What planners are asked: problems, limits, rovers."""
