"""Human review of twins: sampling, annotator queues, durable storage of verdicts, and their statistics."""
