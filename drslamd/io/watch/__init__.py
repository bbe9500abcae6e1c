"""Does everything still move, and did the computer sleep?"""
