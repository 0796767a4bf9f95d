"""Stimuli from photographs and other people's pictures: files of views, and what is done until they are shown."""
