"""Who may use the service: keys, tokens of an identity provider, logins of the page, and what each may do."""
