"""The learner: records, learns between trials, publishes the field."""
