"""How tenants and clients share one service: who sees what, who is next, who has had enough."""
