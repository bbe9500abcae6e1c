"""Does the team ever claim what is not so? Worlds and drives that try it, and what came of them."""
