"""Serial ports before anybody knows what is plugged into them."""
