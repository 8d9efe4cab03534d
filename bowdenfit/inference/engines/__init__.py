"""Who works: this process, more processes here, or a cluster. The seam is `concurrent.futures.Executor`."""
