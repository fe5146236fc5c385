"""What the rover's own motion says of ranges: odometry, headings, tracks."""
