"""What the sensors can say at best, and how near our answers come to it, from the first one on."""
