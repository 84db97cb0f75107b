"""Formats that hold messages on topics: bags of ROS, and MCAP files."""
