"""tools/trust: do published poses know what they do not know?"""
