"""What several requests and answers share: strict models with units in names, and their way into the grid."""
