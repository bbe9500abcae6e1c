"""What a robot remembers only to tell it when somebody asks; no decision rests on it."""
