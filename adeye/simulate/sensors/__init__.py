"""Sensor models: ground truth in, what each sensor would deliver out."""
