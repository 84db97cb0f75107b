"""Identification of two public logs: what holds in another recording, and two coupled joints."""
