"""What comes is opened, and what does not fit one datagram is said in several."""
