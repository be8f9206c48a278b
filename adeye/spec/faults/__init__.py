"""The models of faults that an ODD may name, by kind of what fails."""
