"""File formats that several products read or write."""
