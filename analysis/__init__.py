"""What the answers mean: records, scores, perceptual classes, reports."""
