"""OpenSim's models (.osim)."""
