# zoobench with everything that runs without a GPU. Files are written into the folder, and are yours:
# docker build -t zoobench . && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/data" zoobench list
FROM python:3.12-slim-bookworm

# Pictures and films are drawn without a screen.
RUN apt-get update && apt-get install -y --no-install-recommends libgl1 libosmesa6 libxrender1 && rm -rf /var/lib/apt/lists/*
# The build for the CPU, before anything asks for torch and gets gigabytes of CUDA.
RUN pip install --no-cache-dir torch --index-url https://download.pytorch.org/whl/cpu
WORKDIR /opt/zoobench
COPY . .
RUN pip install --no-cache-dir '.[meshes,parquet,plots,ppo,qd,render,report]' ./verify

# Databases and compiled kernels stay where the folder is mounted.
WORKDIR /data
ENV ZOOBENCH_CACHE=/data/.zoobench-cache
# A user of the machine has no home folder in the image.
ENV MPLCONFIGDIR=/tmp/matplotlib
ENTRYPOINT ["zoobench"]
