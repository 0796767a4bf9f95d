"""Tests of an observer's vision on the rig itself: stereo acuity, colour vision, near acuity."""
