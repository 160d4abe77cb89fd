"""The sections of a calibration's report, each a function of the page and the results."""
