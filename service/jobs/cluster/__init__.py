"""Jobs on the machines of a Dask cluster: ``here`` hands them out, ``there`` is what a Dask worker does with one."""
