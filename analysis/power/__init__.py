"""How many observers a study needs: studies simulated by the thousand, here or on Dask, and what comes out of them."""
