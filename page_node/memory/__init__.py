"""What the robot remembers, as the page shows it; bags are read in a process of its own."""
