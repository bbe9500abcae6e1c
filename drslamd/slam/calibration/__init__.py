"""What the team has learned of its sensors, and how it is used and kept.

The paper has none of it. Entries: `window_calibration.calibrated_window` rids a window of what is
known, `calibration_store.CalibrationStore` keeps it over restarts, `range_scatter.scatter_ratios`
sees how noisy ranges are.
"""
