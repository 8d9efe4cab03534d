from .serialization import plain_data as plain_data
