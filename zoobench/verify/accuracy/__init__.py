"""What accuracy costs in time: how far each cheaper simulation is from a converged one, and what it saves."""
