"""How many observers a study needs: statistical power by simulation of whole studies, locally or on Dask."""
