"""Accuracy and cost: error of each cheaper simulation to a converged one, and the time that it saves."""
