"""Control volumes, cuts through them, morphing maps and their times."""
