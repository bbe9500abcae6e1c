"""Files that other tools open, out of what a daemon answers: TUM, g2o, pyfg, CSV, MCAP."""
