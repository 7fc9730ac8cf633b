"""Studies of the calibration: the paper's Tab. 2, webcams, peers, honesty, faults, boards."""
