"""olivevib: the vibration of a shaken olive tree, measured with two webcams and coded markers."""

__version__ = "0.1.0"
