"""Tests of `cdpr_drake.tension_management`."""
