"""From streams to channels: what each is called, what it means, and how it becomes SI units in NED/FRD axes."""
