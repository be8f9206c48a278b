"""Signal temporal logic over recorded signals: parse, check, evaluate, explain."""
