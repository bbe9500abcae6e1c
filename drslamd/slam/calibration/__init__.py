"""What the team has learned of its sensors, and how it is used and kept.

The paper has none of it. Entries: `window_calibration.calibrated` rids a window of what is known,
`calibration_store.CalibrationStore` keeps it over restarts, `range_scatter.scatter` sees how ranges scatter.
"""
