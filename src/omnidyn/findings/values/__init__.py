"""Single channels: values, stuck, spikes, codes."""
