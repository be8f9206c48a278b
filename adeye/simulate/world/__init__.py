"""The world of a batch of test cases: roads, frames, objects and the storyboard, as arrays."""
