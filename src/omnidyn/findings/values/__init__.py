"""Single channels: values, echoes (of commands), stuck (by wheel_predictor), copies (of another channel), codes,
spikes."""
