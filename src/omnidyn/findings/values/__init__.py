"""Single channels: values (and echoes of commands), stuck, codes (and spikes)."""
