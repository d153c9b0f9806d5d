"""Single channels: values (and echoes of commands), stuck, copies (of another channel), codes (and spikes)."""
