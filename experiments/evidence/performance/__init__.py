"""Speed and accuracy of the simulator, measured; the results and the machine are in README.md."""
