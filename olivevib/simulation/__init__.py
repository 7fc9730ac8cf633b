"""Scenes with known truth, written as a technician would record them."""
