"""Order and sign of columns: wheels and motors, by orders (the choice among them), floor and frame."""
