"""Published errors and costs of the fidelities, and the choice of one by them."""
