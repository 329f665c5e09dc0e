"""The controller: follows the control field from cell to cell and publishes what it decides."""
