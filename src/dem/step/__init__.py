"""One time step: the loop, what runs side by side, gather and scatter, motion."""
