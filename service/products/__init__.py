"""The products: one folder a capability, one registry."""
