"""How the robot learnt, bag by bag: the paper's figures 5 to 7, and the history of the field."""
