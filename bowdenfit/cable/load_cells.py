"""Names of the parameters that several kinds of table share."""

RUN_SCATTER = "tau"
FORCE_NOISE = "sigma_F"
GAIN_ERROR = "gain_error"
BLOCK_NOISE = "sigma_block"
DELAY_ERROR = "delay_error"
INPUT_OFFSET, OUTPUT_OFFSET = "input_offset", "output_offset"
